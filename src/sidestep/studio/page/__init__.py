"""What the browser shows, by viser: the scene and the controls. It never waits for the loop, nor the loop for it."""
