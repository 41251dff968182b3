"""Problems with known answers: each file holds one, its truth and how it is put on a grid.

`discrete` turns a truth into particles and errors, `kinematics` checks a truth's body force,
`catalogue.PROBLEMS` lists them by name.
"""
