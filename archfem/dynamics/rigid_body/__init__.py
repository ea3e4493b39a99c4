"""Free rigid blocks with contact detection, impacts and friction, until they rest.

    bodies             convex pieces, masses, friction, poses and velocities
    contact_detection  contact points by a sorted sweep and separating axes
    time_stepping      Moreau-Jean time stepping
    simulation         frames of a run, its checks, and halved steps
    rocking_body       a stack as one rigid body, by Housner's equation

Start reading at `time_stepping`.
"""
