"""Files of simulations: cells, surfaces, time steps, and a module per format."""
