"""Where the rollers of a cam run: profile slope, roller path, cut flank, and tracks on it as designed and as built."""
