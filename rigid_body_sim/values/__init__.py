"""What users write and read: body, state, wrench, rotations. Checked once, where they are made."""
