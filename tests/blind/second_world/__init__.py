"""A second simulated world, made independently of ``bsip_cli.simulate``.

Nothing here imports from ``bsip_cli``: bodies, movements, balance, skin, lab and files are made by
code of their own, and forces by finite differences of momentum, so that an error which the
simulator and the diagnosis have in common shows. SI units throughout. The lab's frame: x ahead,
y to the left, z up; its origin lies midway between the feet until a file is written.
"""
