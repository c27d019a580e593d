"""A surface that a mechanism follows as the support of an end-effector [Lan, sec. IV]."""
