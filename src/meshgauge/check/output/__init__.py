"""What the gate says, for people, for programs and for what runs in a pipeline. Data in, text out."""
