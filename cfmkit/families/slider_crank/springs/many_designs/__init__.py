"""Many slider-cranks at once that differ in their springs."""
