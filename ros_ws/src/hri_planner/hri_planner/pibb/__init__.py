"""Policies that improve by what people do when they see them: PI^BB and its costs."""
