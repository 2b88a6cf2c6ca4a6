"""What a stiffer or more damped frame does to ball speed and to the handle's vibration."""
