"""What every codec shares: the contract, the registry, and what is coded around any codec."""
