"""From a wish to mechanisms: every family proposes candidates, all are analysed, those that meet the wish are shown."""
