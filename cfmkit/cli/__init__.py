"""The command line: parse, one call, print. One file per verb in `cfmkit.cli.verbs`."""
