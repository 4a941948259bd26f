"""Compiled kernels: arrays in, arrays out; no classes, no validation, no random numbers."""
