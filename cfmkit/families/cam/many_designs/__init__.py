"""Many cams at once: one array operation for all of them where a cam alone takes a model."""
