"""What scene formats share: meshes joined into one sequence, and taken apart again."""
