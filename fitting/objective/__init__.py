"""What a fit minimises: parameters, losses and their uncertainty; knows no solver."""
