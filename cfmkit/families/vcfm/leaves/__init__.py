"""The laws of leaves and of springs that are made of them, in closed form."""
