"""The paper's Table I on recorded drives: the parts of ``table1``."""
