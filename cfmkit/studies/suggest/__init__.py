"""From a wish to mechanisms: every family is asked, what comes of it is analysed, and only what does it is shown."""
