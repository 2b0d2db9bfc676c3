"""The library's subcommands; each module offers one ``command``."""
