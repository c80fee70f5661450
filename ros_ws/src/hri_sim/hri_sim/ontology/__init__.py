"""Two people in each case of the interaction ontology, simulated, and what is measured with them."""
