"""From text to a specification and back: YAML with places, quantities with units, the models of what may be said."""
