"""A complete RTPS/DDSI stack in pure Python."""
