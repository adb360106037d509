"""What was read of a robot, on a page and as a document, before anything is prepared."""
