"""Training data of the network: crops that are rendered during training, kept on its device and augmented."""
