"""Events of venues, and the webhooks and callbacks that deliver them."""
