"""Who answers queries: an oracle on a known reward, and simulated participants."""
