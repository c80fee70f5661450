"""What all nodes share: message imports, parameters, the node base class, conversions."""
