"""Two oblique springs beside a vertical one: quasi-zero stiffness [Carrella, Brennan, Waters 2007]."""
