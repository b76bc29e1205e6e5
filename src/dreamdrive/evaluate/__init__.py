"""How good results are: figures with their sample counts, floors and intervals."""
