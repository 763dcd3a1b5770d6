"""The phases of repair, each a step that raises one thing and keeps what is promised."""
