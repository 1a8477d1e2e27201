"""What asv measures of every commit: by the public names alone, so that these also measure commits of long ago."""
