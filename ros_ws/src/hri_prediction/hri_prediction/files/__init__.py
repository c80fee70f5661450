"""Reading what others wrote, without trusting it: regular files, YAML, JSON, archives of arrays.

Nothing that is read here is ever executed, waited for, or given more memory than its size is worth.
"""
