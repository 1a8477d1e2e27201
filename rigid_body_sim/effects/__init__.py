"""What acts on the body beside a held wrench: one file an effect."""
