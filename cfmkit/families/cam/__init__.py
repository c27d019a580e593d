"""Cam mechanisms: rollers, cam and springs [Sanchez-Salinas et al. 2022]."""
