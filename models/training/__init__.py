"""Makes the U-Net: pictures of pitches that exist nowhere, the network, its training, its figures and its export."""
