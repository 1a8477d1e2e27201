"""A page in the browser that shows bodies as they move. It knows neither ROS nor bags, only looks and moments."""
