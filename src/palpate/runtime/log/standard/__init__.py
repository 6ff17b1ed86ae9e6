"""Topics of types that every ROS 2 tool knows, made from the same rows as palpate's own: in logs, and live."""
