"""What the network eats: crops made as fast as they are learnt, kept where it computes, and altered each time."""
