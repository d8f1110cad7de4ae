"""Bodies that demonstrate at the station: YuMi and a person."""
