"""The sweep as data: passes, and their steps as kernel calls on named slots."""
