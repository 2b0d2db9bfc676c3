"""The coordinator: maps and alignments in, numbered joint maps out."""
