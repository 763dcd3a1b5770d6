"""The options of one subcommand, by subject: dataclasses (`command.unfold`) with what follows from the options alone.

What several subcommands share stands in `cli/options.py`.
"""
