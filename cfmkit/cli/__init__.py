"""The command line: parse, one call, print. One file a verb in `cfmkit.cli.verbs`."""
