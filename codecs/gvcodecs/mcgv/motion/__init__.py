"""Motion prediction: affine transforms per cluster, or skinning weights and transforms."""
