"""Hide effects in measured recordings: `changes` applies them, `folder` walks through a study."""
