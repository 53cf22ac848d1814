"""Deployment: a bundle on a robot's own wires, between a controller without a simulator and a robot, real or rehearsed."""
