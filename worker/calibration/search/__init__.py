"""Search around stored poses: an objective and an evolution strategy."""
