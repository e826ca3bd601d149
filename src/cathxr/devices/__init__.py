"""Device drivers: cameras, and the clocks that time them."""
