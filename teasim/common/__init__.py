"""What all three packages share: errors, registries, parallel maps, files, statistics, settings."""
