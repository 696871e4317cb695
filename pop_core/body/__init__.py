"""The parametric body: joints, model files, kinematics, skinning."""
