"""The preview's panel: what can be edited as plain data, and one window of Dear ImGui that shows it."""
