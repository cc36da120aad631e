"""The engine: arrays in, arrays out, by the stages of the paper."""
