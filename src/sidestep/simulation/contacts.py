"""Which geoms of a MuJoCo model can touch: the type of one meets the affinity of the other.

Arm and scene meet; the arm does not meet itself (neighbouring hulls overlap by construction); objects meet the floor,
not each other (a cluster of obstacles may overlap, as in the thesis's 6.2.3).
"""

ARM_BIT, SCENE_BIT = 1, 2
