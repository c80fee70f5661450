"""Speed and separation monitoring: how fast a robot may be that rests before a person can touch it."""
