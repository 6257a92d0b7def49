"""The proof that the printed object folds: what is claimed of a kit, and which module shows it.

* :mod:`fabfold.proof.certify` is the proof. For the triangles that are printed, hinges included, no
  two bodies come closer than the certified gap at any angle of any move, no body lies inside
  another, and the path ends in shape B. Its bounds are worked out in :mod:`fabfold.proof.gap`, over
  the trees of boxes of :mod:`fabfold.proof.bvh`.
* :mod:`fabfold.proof.sampled` is a second opinion by other means: the same bodies, posed at every
  degree of the path by kinematics of its own, looked at by FCL and manifold3d. It shares no code
  with the proof, and proves nothing between its samples.
* :mod:`fabfold.proof.replay` is a rehearsal in the simulator MuJoCo: motors drive boxes that stand
  for the bodies along the path. It takes the gap between the boxes from the certificate, so it is
  no independent check of the gap.

What none of them says: the meshes are taken as exact and the hinges without play.
"""
