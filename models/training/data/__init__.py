"""What the network eats: pitches kept on disk, courts made as fast as they are learnt."""
