"""Uses of scenes: perception, planning, driving in a closed loop. The stages import none of it."""
