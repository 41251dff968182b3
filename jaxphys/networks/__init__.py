"""Networks that others published, in flax.nnx, checked against their originals.

A module's attributes are named as the keys of the published files, so that loading needs no table
(`parameters.fill`). Pictures are (B, H, W, C), tokens (B, T, C). Modules compute in the dtype of
their input; norms and softmax in float32 or better.
"""
