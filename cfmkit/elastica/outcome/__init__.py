"""What is known of a path of equilibria: motions, reactions, section forces, stresses."""
