"""Recordings: C3D or TRC + MOT into SI arrays in one Z-up world frame."""
