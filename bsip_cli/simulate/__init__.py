"""Simulated studies with a known truth.

The way of the data: `people` draws a person; a movement in `standing` or `moving` sketches joint
angles, feet and support (`plan`, which poses all bodies, too); `balance` finds the pelvis' path
that makes it physically possible, and gets the ground wrench from the rate of momentum;
`recording` splits it between the feet and measures all as a lab would; `study` writes the
folder, with the truth next to it.

What `effects` hide changes the person, the plan or the instruments on this way; `inject`
hides them in measured files. Nothing here is shared with the fitted side but names of
segments and tables of markers.
"""
