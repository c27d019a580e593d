"""Cam and rollers: profile slope, roller path, cut flank, and tracks on it as designed and as built."""
