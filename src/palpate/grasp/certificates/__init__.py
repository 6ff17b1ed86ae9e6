"""Proofs about a grasp: loads that it cannot hold, closure, disturbances, sensitivity."""
