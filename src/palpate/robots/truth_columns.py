"""Names of the numbers that a simulation tells of a fingertip's contact; base frame, forces on the tip."""

TOUCHING = "touching"
POSITION = ("contact_x_m", "contact_y_m", "contact_z_m")
FORCE = ("force_x_N", "force_y_N", "force_z_N")
TORQUE = ("torque_x_Nm", "torque_y_Nm", "torque_z_Nm")
"""About the contact's position."""
