"""Parameter adaptation (sections 6.4.5 to 6.4.7): time steps and roll-outs to suit the situation."""
