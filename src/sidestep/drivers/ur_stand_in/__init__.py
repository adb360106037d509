"""A controller box of Universal Robots that is a program: what it says and how it moves, without a robot.

    python -m sidestep.drivers.ur_stand_in --robot ur10

It listens on 127.0.0.1 only, where the real box has its ports: RTDE (30004), dashboard (29999), scripts (30003).
"""
